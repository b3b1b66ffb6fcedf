"""Parts of the stage that reads records: acceptance of records, batches of record files."""
