"""Composing, settling and certifying scenes of several objects."""
