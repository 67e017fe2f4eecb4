"""The panel of the add-on, without a window: what it says, sets up, watches and draws."""
