"""What is exported: the loop's parts as records of memory, tables of constants, and functions that join them."""
