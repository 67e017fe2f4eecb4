"""Where a fit begins: starts that are looked for without derivatives, and several starts of which the best goes on."""
