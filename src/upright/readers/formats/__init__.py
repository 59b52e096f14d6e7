"""Each format of logs that is read: a reader of it, and what it is made of."""
