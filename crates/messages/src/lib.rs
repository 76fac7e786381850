//! What crosses process borders: fixed-layout messages and the table of topics.
