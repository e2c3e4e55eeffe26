"""Forces of large deflections in modal coordinates, fitted to statics of the whole body."""
