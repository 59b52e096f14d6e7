"""Did the course help, as far as its survey can tell? Ratings before and after, agreement, and printed summaries."""

from upright.questionnaire.grim import Fits, counts, fitting, possible, whole_row
from upright.questionnaire.paired import Paired, compare, holm
from upright.questionnaire.sheet import Item, Likert, Means, Ratings, Shares, read
from upright.questionnaire.summary import Bound, bound

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
