mod free_fall;
mod robot;
mod standing;
