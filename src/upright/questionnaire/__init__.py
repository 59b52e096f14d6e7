"""Did the course help, as far as its survey can tell? Ratings before and after, agreement, and printed summaries."""
