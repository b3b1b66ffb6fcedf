"""Names, directions, sites, catalogues and StationXML."""
