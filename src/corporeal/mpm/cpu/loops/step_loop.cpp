// Hands one thread its next task, as piece << 24 | task, or -1 when the steps end. A phase is over when
// its last task is done, so a thread that the system suspends between tasks delays no other.
typedef int ReadClock(int, long long *);
struct Conduct {
  // Time of the phase that ends, by this thread's clock.
  static inline void note(ThreadPool *pool) {
    long long now[2];   // seconds and nanoseconds
    ((ReadClock *)pool->read_clock)(pool->clock_id, now);
    const double read = (double)now[0] * NANOSECONDS + (double)now[1];
    double *begun = pool->spent + pool->phases;
    if (*begun > 0) pool->spent[pool->now] += read - *begun;
    *begun = read;
  }
  // The last task of a phase is done, or none was begun: open the next phase that has tasks.
  static inline void next_phase(World *world, ThreadPool *pool) {
    if (pool->spent) note(pool);
    for (;;) {
      if (world->stop || world->full) {
        if (pool->spent) pool->spent[pool->phases] = 0;
        __atomic_store_n(&pool->stopped, 1, __ATOMIC_RELEASE);
        return;
      }
      pool->now = pool->now + 1 < pool->phases ? pool->now + 1 : 0;
      const int *phase = pool->phase + 4 * pool->now;
      int count = phase[2] >= 0 ? phase[2] : *(int *)((char *)world + phase[3]);
      if (count <= 0) continue;
      pool->piece = phase[0];
      pool->first = phase[1];
      pool->count = count;
      pool->done = 0;
      int epoch = (pool->epoch + 1) & 0xffffff, T = pool->threads;
      for (int t = 0; t < T; t++) {
        u64 high = t < count ? (u64)((count - t + T - 1) / T) : 0, share = (u64)epoch << 40 | high;
        __atomic_store_n(&pool->post[t].share, share, __ATOMIC_RELAXED);
      }
      __atomic_store_n(&pool->epoch, epoch, __ATOMIC_RELEASE);
      return;
    }
  }
  // Claim a task of this epoch from one's own share, every so manieth task, or from another's: the
  // largest tasks come first, so that the last ones to end are small.
  static inline int claim(ThreadPool *pool, int thread, int epoch) {
    for (int k = 0; k < pool->threads; k++) {
      int t = thread + k < pool->threads ? thread + k : thread + k - pool->threads;
      u64 *share = &pool->post[t].share, word = __atomic_load_n(share, __ATOMIC_ACQUIRE);
      while ((int)(word >> 40) == epoch && (word >> 20 & 0xfffff) < (word & 0xfffff)) {
        if (__atomic_compare_exchange_n(share, &word, word + (1 << 20), 0, __ATOMIC_ACQ_REL,
                                        __ATOMIC_ACQUIRE))
          return (int)(word >> 20 & 0xfffff) * pool->threads + t;
      }
    }
    return -1;
  }
  static inline void pause() {
#if defined(__x86_64__)
    __builtin_ia32_pause();
#elif defined(__aarch64__)
    asm volatile("yield");
#endif
  }
};
const int PATIENCE = 200;   // pauses before a waiting thread offers its core to others
ThreadPool *pool = world->thread_pool;
Post *post = pool->post + thread;
if (post->busy) {
  post->busy = 0;
  const int count = pool->count;   // read before: once all are done another thread may change it
  if (__atomic_add_fetch(&pool->done, 1, __ATOMIC_ACQ_REL) == count)
    Conduct::next_phase(world, pool);
} else if (thread == 0 && !pool->started) {
  pool->started = 1;
  Conduct::next_phase(world, pool);
}
int seen = -1, waited = 0;
for (;;) {
  if (__atomic_load_n(&pool->stopped, __ATOMIC_ACQUIRE)) return -1;
  int epoch = __atomic_load_n(&pool->epoch, __ATOMIC_ACQUIRE);
  if (epoch != seen) {
    int piece = pool->piece, first = pool->first, task = Conduct::claim(pool, thread, epoch);
    if (task >= 0) {
      post->busy = 1;
      return piece << 24 | (first + task);
    }
    seen = epoch;
  }
  if (++waited > PATIENCE && pool->yield_core)
    ((Call *)pool->yield_core)();
  else
    Conduct::pause();
}
