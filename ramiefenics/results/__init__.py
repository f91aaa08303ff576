"""What a result becomes on disk: tables, manifest, fields, pictures."""
