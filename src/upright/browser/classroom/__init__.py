"""A class in front of the bench: a twin for each student, all in one process, and a page that shows them all."""
