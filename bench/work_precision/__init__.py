"""Work-precision diagrams: error against time over many cases, with the peers a user would pick on the same axes."""
