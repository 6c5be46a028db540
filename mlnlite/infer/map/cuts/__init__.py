"""Best worlds by programs to which rows are added as they are violated."""
