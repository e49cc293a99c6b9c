"""Links to vehicles: where live bytes come from, and the tlog they are recorded in."""
