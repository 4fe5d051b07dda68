"""Material fields of other methods: read, registered with a scene, and summed up per part."""
