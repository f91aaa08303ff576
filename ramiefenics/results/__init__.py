"""What the results of all studies have in common: text, tables, figures, folders, pages."""
