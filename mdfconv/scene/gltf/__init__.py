"""glTF assets."""
