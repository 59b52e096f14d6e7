"""Pictures that answer in a page: traces with cursor and zoom (drawn by uPlot, MIT), values at the points of a map."""
