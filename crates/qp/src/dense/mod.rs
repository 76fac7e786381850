//! Small dense problems, solved again and again.
