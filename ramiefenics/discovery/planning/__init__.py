"""What tests could show, and which second test separates suspects."""
