"""Round columns shaken in both horizontal directions."""
