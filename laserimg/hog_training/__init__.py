"""Training of HOG windows with a linear SVM, negatives mined in rounds."""
