"""Mean dilatation of nearly incompressible material on the device.

Means are taken over the particles of 2³ cells of a field, as ``reference.mean_dilatation`` has it.
"""

from corporeal.mpm import formulas
from corporeal.mpm.cuda.block_grid import block_of, find_block
from corporeal.mpm.cuda.channel_rows import cell_at, matrix_at
from corporeal.mpm.cuda.layout import (
    DENSITY,
    FLAG_FULL,
    LAMBDA,
    LAW,
    MU,
    STIFFENING,
    USES_MEAN_DILATATION,
    BlockGrid,
    DeviceParticles,
    StepGlobals,
    wp,
)
from corporeal.mpm.formulas.one_lane import mean_bulk, mean_pressure

wp.set_module_options(formulas.formula_options(max_unroll=0))


@wp.kernel
def sum_clusters(p: DeviceParticles, g: BlockGrid, stride: int):
    """Add up volume, and volume times pressure, of every cluster."""
    for i in range(wp.tid(), p.count, stride):
        if p.table[p.kind[i], USES_MEAN_DILATATION] > 0.0:
            cell = cell_at(p.cell, i)
            if p.home[i] < 0:
                p.home[i] = find_block(g, p.field[i], block_of(cell))
            pair = wp.vec3i((cell[0] >> 1) & 1, (cell[1] >> 1) & 1, (cell[2] >> 1) & 1)
            at = 8 * p.home[i] + 4 * pair[0] + 2 * pair[1] + pair[2]
            p.cluster[i] = at
            wp.atomic_add(g.pool, 0, at, p.volume[i])
            wp.atomic_add(g.pool, 1, at, p.volume[i] * p.pressure[i])


@wp.kernel
def apply_mean_pressure(p: DeviceParticles, g: BlockGrid, s: StepGlobals, stride: int):
    """Give every particle the pressure of its mean dilatation after this step."""
    if s.flag[FLAG_FULL] == 2:
        return
    for i in range(wp.tid(), p.count, stride):
        row = p.kind[i]
        if p.table[row, USES_MEAN_DILATATION] > 0.0:
            at = p.cluster[i]
            log_volume_ratio = p.log_volume_ratio[i] + g.pool[2, at] / g.pool[0, at] - p.grown[i]
            law = p.table[row, LAW]
            bulk = mean_bulk(law, p.table[row, MU], p.table[row, LAMBDA])
            found = mean_pressure(law, bulk, matrix_at(p.strain, i), log_volume_ratio)
            p.log_volume_ratio[i] = log_volume_ratio
            p.pressure[i] = found[0]
            wave = wp.sqrt((p.bound[i] + found[1]) / p.table[row, DENSITY])
            wave = wave * p.table[row, STIFFENING]
            if p.lost[i] == 0 and wave > s.fast[1]:
                wp.atomic_max(s.fast, 1, wave)
