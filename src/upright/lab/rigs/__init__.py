"""The rigs of the laboratory: twins, makes, and rigs known from a fit."""
