/* What the equations look up in tables: the cell that a place is in, and the product of a matrix and a vector. */

/* The last of some starts in order that is not above x; the first for what is below it, and for NaN. */
static inline size_t find_cell(const double *starts, size_t count, double x)
{
    size_t low = 0, high = count;
    while (high - low > 1) {
        size_t middle = low + (high - low) / 2;
        if (x >= starts[middle]) {
            low = middle;
        } else {
            high = middle;
        }
    }
    return low;
}

/* The matrix stands column by column: each sum goes from its first term to the last, and all go on together. */
static inline void multiply(const double *matrix, size_t rows, size_t columns, const double *x, double *result)
{
    for (size_t i = 0; i < rows; i++) {
        result[i] = 0.0;
    }
    for (size_t j = 0; j < columns; j++) {
        for (size_t i = 0; i < rows; i++) {
            result[i] = result[i] + matrix[j * rows + i] * x[j];
        }
    }
}
