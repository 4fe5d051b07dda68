// Hands one thread its next task, as piece << 24 | task, or -1 when the steps end. A phase is over when
// its last task is done, so a thread that the system put to sleep between tasks holds nobody up.
struct Conduct {
  // The last task of a phase is done, or none was begun: open the next phase that has tasks.
  static inline void next_phase(World *world, Crew *crew) {
    for (;;) {
      if (world->stop || world->full) {
        __atomic_store_n(&crew->stopped, 1, __ATOMIC_RELEASE);
        return;
      }
      crew->now = crew->now + 1 < crew->phases ? crew->now + 1 : 0;
      const int *phase = crew->phase + 4 * crew->now;
      int count = phase[2] >= 0 ? phase[2] : *(int *)((char *)world + phase[3]);
      if (count <= 0) continue;
      crew->piece = phase[0];
      crew->first = phase[1];
      crew->count = count;
      crew->done = 0;
      int epoch = (crew->epoch + 1) & 0xffffff, T = crew->threads;
      for (int t = 0; t < T; t++) {
        u64 high = t < count ? (u64)((count - t + T - 1) / T) : 0, share = (u64)epoch << 40 | high;
        __atomic_store_n(&crew->post[t].share, share, __ATOMIC_RELAXED);
      }
      __atomic_store_n(&crew->epoch, epoch, __ATOMIC_RELEASE);
      return;
    }
  }
  // Claim a task of this epoch from one's own share, every so manieth task, or from another's: the
  // largest tasks come first, so that the last ones to end are small.
  static inline int claim(Crew *crew, int thread, int epoch) {
    for (int k = 0; k < crew->threads; k++) {
      int t = thread + k < crew->threads ? thread + k : thread + k - crew->threads;
      u64 *share = &crew->post[t].share, word = __atomic_load_n(share, __ATOMIC_ACQUIRE);
      while ((int)(word >> 40) == epoch && (word >> 20 & 0xfffff) < (word & 0xfffff)) {
        if (__atomic_compare_exchange_n(share, &word, word + (1 << 20), 0, __ATOMIC_ACQ_REL,
                                        __ATOMIC_ACQUIRE))
          return (int)(word >> 20 & 0xfffff) * crew->threads + t;
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
Crew *crew = world->crew;
Post *post = crew->post + thread;
if (post->busy) {
  post->busy = 0;
  const int count = crew->count;   // read before: once all are done another thread may change it
  if (__atomic_add_fetch(&crew->done, 1, __ATOMIC_ACQ_REL) == count)
    Conduct::next_phase(world, crew);
} else if (thread == 0 && !crew->started) {
  crew->started = 1;
  Conduct::next_phase(world, crew);
}
int seen = -1, waited = 0;
for (;;) {
  if (__atomic_load_n(&crew->stopped, __ATOMIC_ACQUIRE)) return -1;
  int epoch = __atomic_load_n(&crew->epoch, __ATOMIC_ACQUIRE);
  if (epoch != seen) {
    int piece = crew->piece, first = crew->first, task = Conduct::claim(crew, thread, epoch);
    if (task >= 0) {
      post->busy = 1;
      return piece << 24 | (first + task);
    }
    seen = epoch;
  }
  if (++waited > PATIENCE && crew->nap)
    crew->nap();
  else
    Conduct::pause();
}
