"""Read files, archives and folders, each file in a worker process."""
