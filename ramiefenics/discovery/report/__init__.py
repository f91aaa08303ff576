"""What discovery found, in words, tables and figures."""
