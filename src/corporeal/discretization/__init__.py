"""How each part is simulated: solid, shell, sheet or filled, with which parameters."""
