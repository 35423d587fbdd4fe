"""How k-d trees are built, one file a builder."""
