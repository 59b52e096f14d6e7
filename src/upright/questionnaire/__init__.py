"""Did the course help, as far as its survey can tell? Ratings before and after, agreement, and printed summaries."""

from upright.questionnaire.paired import Paired, compare, holm
from upright.questionnaire.printed import Bound, Fits, bound, counts, fitting, possible, whole_row
from upright.questionnaire.sheet import Item, Likert, Means, Ratings, Shares, read

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
