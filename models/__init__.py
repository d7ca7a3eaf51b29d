"""Networks as code: torch modules and how each is trained. Trained weights live in artifacts/, never here."""
