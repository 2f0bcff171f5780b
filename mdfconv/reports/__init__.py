"""The pages of the report folder, and their index."""
