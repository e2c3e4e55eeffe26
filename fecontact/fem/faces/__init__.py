"""Contact faces of solids: their facets, cut into patches, and the frames of contact nodes."""
