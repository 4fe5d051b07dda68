"""Material fields predicted by other methods: reading, registration, averages per part."""
