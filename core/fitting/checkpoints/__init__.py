"""The state of a fit, stored in a file, and what tells whether a file belongs to a fit."""
