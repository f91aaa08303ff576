"""What all studies' results have in common: words, tables, figures, folders, pages."""
