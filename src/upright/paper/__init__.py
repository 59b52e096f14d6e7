"""What did the paper print, and does it hold? ASEE 2006-1008, tables as printed and formulas as printed."""
