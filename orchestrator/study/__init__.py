"""Many runs of one system: batches, studies, the search for what breaks a requirement."""
