"""Did the course help, as far as its survey can tell? Ratings before and after, agreement, and printed summaries."""

from upright.survey.grim import Fits, counts, fitting, possible, whole_row
from upright.survey.paired import Paired, compare, holm
from upright.survey.sheet import Item, Likert, Means, Ratings, Shares, read
from upright.survey.summary import Bound, bound

__all__ = [
    "Bound",
    "Fits",
    "Item",
    "Likert",
    "Means",
    "Paired",
    "Ratings",
    "Shares",
    "bound",
    "compare",
    "counts",
    "fitting",
    "holm",
    "possible",
    "read",
    "whole_row",
]
