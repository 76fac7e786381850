//! The walk as data: phases, polynomials and footholds, evaluated at any time.
