/* What an FMU may do to the process it is in, to its descriptors, and to processes, by name; see hostile.c. What writes a
   log of its own writes it to the file that the environment variable DEEDS names. Does nothing where it knows no deed. */

#include <fcntl.h>
#include <pthread.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/wait.h>

#define FLOOD_LINES 20000 /* 2 MB */
#define OWN_LINES 100000 /* 5.7 MB */

static const char *own_log(void)
{
    return getenv("DEEDS");
}

static void linger(int seconds)
{
    for (int k = 0; k < seconds * 10; k++) {
        usleep(100000);
    }
    _exit(0);
}

static void *forever(void *how)
{
    for (int k = 0;; k++) {
        if (how) {
            printf("from a thread: %d\n", k);
        } else {
            usleep(1000);
        }
    }
    return NULL;
}

static void *leave(void *code)
{
    exit(*(int *)code);
}

static int overflow(volatile char *before)
{
    volatile char here[4096];
    here[0] = before ? before[0] : 1;
    return overflow(here) + here[0];
}

static void limit(int what, rlim_t most)
{
    struct rlimit limits = {most, most};
    setrlimit(what, &limits);
}

/* To its streams and descriptors. */
static int disturb_streams(const char *what)
{
    char buffer[100];
#define DOES(name) (strcmp(what, name) == 0)
    if (DOES("reopen") || DOES("reopen_stderr")) {
        FILE *stream = freopen(own_log(), "a", DOES("reopen") ? stdout : stderr);
        for (int k = 0; k < OWN_LINES; k++) {
            fprintf(stream, "line %d of a log of its own that is not to be touched\n", k);
        }
        fflush(stream);
    } else if (DOES("close_streams")) {
        close(1);
        close(2);
        int own = open(own_log(), O_CREAT | O_WRONLY | O_APPEND, 0600); /* which is 1 now */
        dprintf(own, "mine\n");
    } else if (DOES("dup_streams")) {
        int own = open(own_log(), O_CREAT | O_WRONLY | O_APPEND, 0600);
        dup2(own, 1);
        dup2(own, 2);
        close(own);
        printf("mine\n");
        fflush(stdout);
    } else if (DOES("flood")) {
        for (int k = 0; k < FLOOD_LINES; k++) {
            printf("%099d\n", k);
        }
    } else if (DOES("garbage")) {
        for (int k = 0; k < 100000; k++) {
            putchar(k * 7919 >> 3);
        }
        puts("\n\x1b]0;title\x07\x1b[2J \xe2\x80\xae evil");
    } else if (DOES("never_newline")) {
        printf("%099999d", 0);
        fflush(stdout);
    } else if (DOES("read")) {
        return read(0, buffer, 1) == 0 && getchar() == EOF ? 0 : 3;
    } else if (DOES("hurry")) {
        fcntl(1, F_SETFL, fcntl(1, F_GETFL) | O_NONBLOCK);
        return disturb_streams("flood");
    } else if (DOES("close_some") || DOES("close_all")) {
        for (int k = DOES("close_all") ? 0 : 3; k < (DOES("close_all") ? sysconf(_SC_OPEN_MAX) : 1024); k++) {
            close(k);
        }
        int own = open(own_log(), O_CREAT | O_WRONLY | O_APPEND, 0600);
        dprintf(own, "mine\n");
    } else if (DOES("replace_all")) { /* by a file of its own, which must not be written into */
        int own = open(own_log(), O_CREAT | O_WRONLY | O_APPEND, 0600);
        for (int k = 0; k < sysconf(_SC_OPEN_MAX); k++) {
            if (k != own && fcntl(k, F_GETFD) != -1) {
                dup2(own, k);
            }
        }
        dprintf(own, "mine\n");
    } else if (DOES("send") || DOES("send_frame")) {
        for (int k = 3; k < sysconf(_SC_OPEN_MAX); k++) {
            send(k, DOES("send") ? "hello" : "\x12\xff\xff\xff\x7f junk", 10, MSG_NOSIGNAL | MSG_DONTWAIT);
        }
    }
    return 0;
}

/* To its process. */
static int disturb_process(const char *what)
{
    static int seven = 7;
    pthread_t thread;
    sigset_t all;
    if (DOES("chdir")) {
        return chdir("/");
    } else if (DOES("umask")) {
        umask(0777);
    } else if (DOES("no_files")) {
        limit(RLIMIT_NOFILE, 0);
    } else if (DOES("no_file_size")) {
        limit(RLIMIT_FSIZE, 0);
    } else if (DOES("no_memory")) {
        limit(RLIMIT_AS, 1 << 20);
    } else if (DOES("no_processes")) {
        limit(RLIMIT_NPROC, 0);
    } else if (DOES("no_time")) {
        limit(RLIMIT_CPU, 1);
        for (volatile int k = 0;; k++) {
        }
    } else if (DOES("deaf")) {
        for (int k = 1; k < 65; k++) {
            signal(k, SIG_IGN);
        }
        sigfillset(&all);
        sigprocmask(SIG_BLOCK, &all, NULL);
    } else if (DOES("alarm")) {
        alarm(1);
        sleep(3);
    } else if (strncmp(what, "raise_", 6) == 0) {
        raise(atoi(what + 6));
    } else if (DOES("exit0")) {
        exit(0);
    } else if (DOES("_exit0")) {
        _exit(0);
    } else if (DOES("quick_exit")) {
        quick_exit(0);
    } else if (DOES("thread_exit")) {
        pthread_create(&thread, NULL, leave, &seven);
        pthread_join(thread, NULL);
    } else if (DOES("end_thread")) {
        pthread_exit(NULL);
    } else if (DOES("threads") || DOES("loud_thread")) {
        pthread_create(&thread, NULL, forever, DOES("loud_thread") ? &seven : NULL);
    } else if (DOES("overflow")) {
        return overflow(NULL) == 0;
    } else if (DOES("divide")) {
        volatile int zero = 0;
        return 100 / zero;
    } else if (DOES("trap")) {
        __builtin_trap();
    } else if (DOES("twice")) {
        void *volatile lost = malloc(100);
        free(lost);
        free(lost);
    } else if (DOES("session")) {
        setsid();
        setpgid(0, 0);
    } else if (DOES("seccomp")) {
        prctl(PR_SET_SECCOMP, 1);
    } else if (DOES("orphan")) { /* wants to outlive its parent */
        prctl(PR_SET_PDEATHSIG, 0);
    } else if (DOES("exec")) {
        execl("/bin/sleep", "sleep", "60", NULL);
    } else if (DOES("daemon")) {
        return daemon(0, 0);
    } else if (DOES("kill_group")) {
        kill(0, SIGKILL);
    } else if (DOES("end_group")) {
        kill(0, SIGTERM);
    } else if (DOES("kill_parent")) {
        kill(getppid(), SIGKILL);
        usleep(300000);
    } else if (DOES("end_parent")) {
        kill(getppid(), SIGTERM);
        sleep(60);
    } else if (DOES("stop_parent")) {
        kill(getppid(), SIGSTOP);
    }
    return 0;
}

/* Processes of its own. */
static int start_processes(const char *what)
{
    if (DOES("child") || DOES("child_cry")) {
        if (fork() == 0) {
            linger(60);
        }
        if (DOES("child_cry")) {
            abort();
        }
    } else if (DOES("grandchild") || DOES("grandchild_cry")) {
        pid_t child = fork();
        if (child == 0) {
            setsid();
            if (fork() == 0) {
                setsid();
                prctl(PR_SET_PDEATHSIG, 0);
                signal(SIGTERM, SIG_IGN);
                linger(60);
            }
            _exit(0);
        }
        waitpid(child, NULL, 0);
        if (DOES("grandchild_cry")) {
            abort();
        }
    } else if (DOES("many")) {
        for (int k = 0; k < 50; k++) {
            start_processes("grandchild");
        }
    } else if (DOES("shell")) {
        return system("(sleep 60 & sleep 60 &) ; nohup sleep 60 >/dev/null 2>&1 &");
    } else if (DOES("popen")) {
        return popen("while :; do echo x; sleep 0.01; done", "r") == NULL;
    } else if (DOES("talker")) { /* a child that prints for ever */
        if (fork() == 0) {
            for (;;) {
                printf("%0999d\n", 1);
            }
        }
    } else if (DOES("come_back")) { /* a child that returns from the call */
        fork();
    } else if (DOES("breeder")) { /* a child whose children take turns */
        if (fork() == 0) {
            for (int k = 0; k < 2000; k++) {
                if (fork() > 0) {
                    _exit(0);
                }
                usleep(1000);
            }
        }
    }
    return 0;
}

static int do_deed(const char *what)
{
    int streams = disturb_streams(what), process = disturb_process(what), others = start_processes(what);
    return streams | process | others;
}
