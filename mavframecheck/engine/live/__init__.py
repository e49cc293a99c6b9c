"""The engine on a link: the same rules on small batches, and findings as they come."""
