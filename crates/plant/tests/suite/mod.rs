mod balance;
mod configuration;
mod free_fall;
mod interface;
mod robot;
mod standing;
