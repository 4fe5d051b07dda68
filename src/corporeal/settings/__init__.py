"""What a person may ask of every verb: read without what does it."""
