"""How good it is: what was predicted against what was measured."""
