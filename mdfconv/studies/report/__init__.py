"""The pages of the report and their index."""
