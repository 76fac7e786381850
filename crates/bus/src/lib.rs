//! The messages over iceoryx2 shared memory.
