"""The verbs. One file, one function, one command, one folder of results."""
