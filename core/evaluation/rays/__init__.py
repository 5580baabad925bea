"""Where rays come from: workloads, cameras, lights, files."""
