"""What files are, what their numbers mean, and what converts them."""
