// Types of the bundled library are not checked.
export {};
