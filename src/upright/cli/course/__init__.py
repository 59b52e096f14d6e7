"""A course: the experiments on twins, the paper's tables, the survey."""
