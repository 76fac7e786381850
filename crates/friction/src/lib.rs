//! Signorini-Coulomb contact problems with a dense Delassus operator.
