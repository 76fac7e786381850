mod balance;
mod configuration;
mod free_fall;
mod robot;
mod standing;
