"""Everyday things made by code, whose masses follow from how they are built."""
