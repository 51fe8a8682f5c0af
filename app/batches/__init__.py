"""Many requests as one job: taken in as a stream, solved piece by piece, handed out as a stream."""
