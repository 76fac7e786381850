mod balance;
mod configuration;
mod free_fall;
mod impact;
mod interface;
mod levels;
mod robot;
mod standing;
